"""Cells to regions: Recast's watershed on the distance to the border, then merging and dropping of small regions.

Region 0 means none. Every region is simply shaped enough for its outline (and holes) to become polygons: no region
lies above itself.

Before: :mod:`.compact`. After: :mod:`.contours`.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from prnav.navmesh.compact import CompactField

EXPAND_STEPS = 8  # rounds that regions grow per water level before new ones start
STACK_LEVELS = 8  # water levels that one sort of the cells serves
NO_DISTANCE = 0x3FFFFFFF


def watershed_regions(
    field: CompactField, distance: NDArray[np.int32], largest: int, min_area: int, merge_area: int
) -> tuple[NDArray[np.int32], int]:
    """Region of each cell, (N,), and the number of regions.

    Args:
        field: The eroded cells.
        distance: Blurred distance to the border per cell, (N,) [half cells].
        largest: Largest distance before the blur.
        min_area: Groups of connected regions smaller than this are dropped [cells].
        merge_area: Regions smaller than this are merged into a neighbour where possible [cells].
    """
    region, count = _flood(field.connected, field.area, distance, largest)
    ids = count + 1
    above, below = _stacked(field, region, ids)
    stacked = np.zeros(ids, np.bool_)
    stacked[above[above == below]] = True
    size = np.zeros(ids, np.int64)
    first = np.zeros(2 * ids, np.int64)
    length = np.zeros(2 * ids, np.int64)
    pool = np.zeros(8 * ids + 1024, np.int64)
    while (used := _outlines(field.connected, region, size, pool, first, length)) > len(pool):
        pool = np.zeros(2 * used, np.int64)
        size[:] = 0
        length[:] = 0
    _drop_small(min_area, size, pool, first, length, np.empty(ids, np.int64))
    alive = size > 0
    first[ids:] = used + np.searchsorted(above, np.arange(ids))
    length[ids:] = np.bincount(above, minlength=ids)
    pool = np.concatenate([pool[:used], below, np.zeros(8 * ids + 1024, np.int64)])
    used += len(below)
    alias = np.arange(ids)
    while True:
        done, used = _merge(merge_area, stacked, alive, size, alias, pool, used, first, length)
        if done:
            break
        pool = np.concatenate([pool, np.zeros(len(pool), np.int64)])
    while (alias != alias[alias]).any():
        alias = alias[alias]
    kept = alive[alias]
    final = np.zeros(ids, np.int32)
    _, first_seen, number = np.unique(alias[kept], return_index=True, return_inverse=True)
    final[kept] = 1 + np.argsort(np.argsort(first_seen))[number]  # numbered in the order of their first part
    return final[region], len(first_seen)


def _stacked(field: CompactField, region: NDArray[np.int32], ids: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of regions that share a column, each in both orders, sorted; a region over itself is a pair too."""
    keys = np.empty(1 << 16, np.int64)
    while (count := _stacked_pairs(field.start, region, ids, np.full(1 << 16, -1), keys)) > len(keys):
        keys = np.empty(count, np.int64)
    pairs = np.unique(keys[:count])
    return pairs // ids, pairs % ids


@njit(cache=True, nogil=True, error_model="numpy")
def _flood(connected, area, distance, largest):
    """Watershed: from the innermost cells outwards, regions grow and new ones start where none reaches."""
    count = len(area)
    region = np.zeros(count, np.int32)
    cost = np.zeros(count, np.int32)  # steps from the region's first cells
    work = np.empty(count, np.int32)
    spare = np.empty(count, np.int32)
    flood = np.empty(count, np.int32)
    new_cell = np.empty(count, np.int32)
    new_region = np.empty(count, np.int32)
    new_cost = np.empty(count, np.int32)
    ordered = np.empty(count, np.int32)
    offset = np.zeros(STACK_LEVELS + 1, np.int64)
    cursor = np.zeros(STACK_LEVELS, np.int64)
    num_work = 0
    num_regions = 0
    step = -1
    level = (largest + 1) // 2 * 2
    last = False
    while True:
        if level > 0:
            level = max(level - 2, 0)
            step = (step + 1) % STACK_LEVELS
            if step == 0:  # sort the cells without a region by level, for this and the next levels
                num_work = 0
                for slot in range(STACK_LEVELS + 1):
                    offset[slot] = 0
                for i in range(count):
                    if area[i] != 0 and region[i] == 0:
                        slot = max(level // 2 - distance[i] // 2, 0)
                        if slot < STACK_LEVELS:
                            offset[slot + 1] += 1
                for slot in range(STACK_LEVELS):
                    offset[slot + 1] += offset[slot]
                    cursor[slot] = offset[slot]
                for i in range(count):
                    if area[i] != 0 and region[i] == 0:
                        slot = max(level // 2 - distance[i] // 2, 0)
                        if slot < STACK_LEVELS:
                            ordered[cursor[slot]] = i
                            cursor[slot] += 1
            num_spare = 0
            for k in range(offset[step], offset[step + 1]):
                if region[ordered[k]] == 0:
                    spare[num_spare] = ordered[k]
                    num_spare += 1
            for k in range(num_work):  # left over from the level above
                if region[work[k]] == 0:
                    spare[num_spare] = work[k]
                    num_spare += 1
            work, spare = spare, work
            num_work = num_spare
            rounds = EXPAND_STEPS if level > 0 else -1
        else:
            last = True
            num_work = 0
            for i in range(count):
                if area[i] != 0 and region[i] == 0:
                    work[num_work] = i
                    num_work += 1
            rounds = -1
        while num_work > 0 and rounds != 0:  # grow the regions by one cell a round
            rounds -= 1
            num_new = 0
            num_left = 0
            for k in range(num_work):
                i = work[k]
                best = NO_DISTANCE
                best_region = 0
                for direction in range(4):
                    j = connected[i, direction]
                    if j >= 0 and area[j] == area[i] and region[j] > 0 and cost[j] + 2 < best:
                        best = cost[j] + 2
                        best_region = region[j]
                if best_region > 0:
                    new_cell[num_new] = i
                    new_region[num_new] = best_region
                    new_cost[num_new] = best
                    num_new += 1
                else:
                    work[num_left] = i
                    num_left += 1
            for k in range(num_new):
                region[new_cell[k]] = new_region[k]
                cost[new_cell[k]] = new_cost[k]
            num_work = num_left
            if num_new == 0:
                break
        if last:
            return region, num_regions
        for k in range(num_work):  # new regions from the cells that none has reached
            if region[work[k]] != 0:
                continue
            r = num_regions + 1
            low = max(level - 2, 0)
            seed = work[k]
            region[seed] = r
            cost[seed] = 0
            flood[0] = seed
            num_flood = 1
            size = 0
            while num_flood > 0:
                num_flood -= 1
                i = flood[num_flood]
                touches = False  # cells that touch another region are left to its growth
                for direction in range(4):
                    j = connected[i, direction]
                    if j < 0 or area[j] != area[i]:
                        continue
                    if region[j] != 0 and region[j] != r:
                        touches = True
                        break
                    corner = connected[j, (direction + 1) % 4]
                    if corner >= 0 and area[corner] == area[i] and region[corner] != 0 and region[corner] != r:
                        touches = True
                        break
                if touches:
                    region[i] = 0
                    continue
                size += 1
                for direction in range(4):
                    j = connected[i, direction]
                    if j >= 0 and area[j] == area[i] and distance[j] >= low and region[j] == 0:
                        region[j] = r
                        cost[j] = 0
                        flood[num_flood] = j
                        num_flood += 1
            if size > 0:
                num_regions = r


@njit(cache=True, nogil=True, error_model="numpy")
def _stacked_pairs(start, region, num_ids, recent, keys):
    """Keys ``a * num_ids + b`` of regions that share a column, some repeated; fills ``keys`` while there is room.

    ``recent`` (a power of two of entries) spares most of the repeats. Returns the number of keys.
    """
    mask = len(recent) - 1
    count = 0
    for column in range(len(start) - 1):
        for i in range(start[column], start[column + 1]):
            for j in range(start[column], start[column + 1]):
                if i == j or region[i] == 0 or region[j] == 0:
                    continue
                key = np.int64(region[i]) * num_ids + region[j]
                slot = (key * 0x9E3779B1 >> 8) & mask
                if recent[slot] != key:
                    recent[slot] = key
                    if count < len(keys):
                        keys[count] = key
                    count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def _find(alias, r):
    """The region that r has been merged into."""
    while alias[r] != r:
        alias[r] = alias[alias[r]]
        r = alias[r]
    return r


@njit(cache=True, nogil=True, error_model="numpy")
def _tidy(alias, pool, first, size, which):
    """Name the regions of a list by what they were merged into; drop neighbours that repeat in a list of neighbours."""
    cyclic = which < len(alias)
    begin = first[which]
    kept = 0
    for k in range(begin, begin + size[which]):
        r = _find(alias, pool[k])
        if not cyclic or kept == 0 or pool[begin + kept - 1] != r:
            pool[begin + kept] = r
            kept += 1
    if cyclic and kept > 1 and pool[begin + kept - 1] == pool[begin]:
        kept -= 1
    size[which] = kept


@njit(cache=True, nogil=True, error_model="numpy")
def _outlines(connected, region, size, pool, first, length):
    """Size of each region, and the regions that are met around the outline of each, in order.

    The outline is that of the region's first border cell. Fills ``size``, ``pool`` (while there is room), and where a
    region's list begins and its length; returns the room needed.
    """
    used = 0
    for cell in range(len(region)):
        r = region[cell]
        if r == 0:
            continue
        size[r] += 1
        if length[r] > 0:
            continue
        border = -1
        for direction in range(4):
            j = connected[cell, direction]
            if border < 0 and (region[j] if j >= 0 else 0) != r:
                border = direction
        if border < 0:
            continue
        begin = used
        i = np.int64(cell)
        side = border
        met = -1
        while True:
            j = np.int64(connected[i, side])
            beyond = region[j] if j >= 0 else 0
            if beyond != r:
                if beyond != met:
                    met = beyond
                    if used < len(pool):
                        pool[used] = met
                    used += 1
                side = (side + 1) % 4
            else:
                i = j
                side = (side + 3) % 4
            if i == cell and side == border:
                break
        if used - begin > 1 and used <= len(pool) and pool[used - 1] == pool[begin]:
            used -= 1
        first[r] = begin
        length[r] = used - begin
    return used


@njit(cache=True, nogil=True, error_model="numpy")
def _drop_small(min_area, size, pool, first, length, group):
    """Set the size of regions to 0 whose group of connected regions is smaller than ``min_area``."""
    seen = np.zeros(len(size), np.bool_)
    for r in range(1, len(size)):
        if seen[r] or size[r] == 0:
            continue
        seen[r] = True
        group[0] = r
        members = 1
        done = 0
        total = 0
        while done < members:
            here = group[done]
            done += 1
            total += size[here]
            for k in range(first[here], first[here] + length[here]):
                other = pool[k]
                if other != 0 and not seen[other]:
                    seen[other] = True
                    group[members] = other
                    members += 1
        if total < min_area:
            for k in range(members):
                size[group[k]] = 0


@njit(cache=True, nogil=True, error_model="numpy")
def _merge(merge_area, stacked, alive, size, alias, pool, used, first, length):
    """Merge small regions, and those enclosed by others, into their smallest neighbour; in place.

    List r of the pool holds the neighbours of region r, list R + r the regions above or below it (R = number of
    regions and 0). A region that was merged stays in other lists until they are tidied. Returns False where the pool
    has run out of room: call again with a larger one.
    """
    ids = len(size)
    merging = True
    while merging:
        merging = False
        for r in range(1, ids):
            if not alive[r] or alias[r] != r or stacked[r]:
                continue
            _tidy(alias, pool, first, length, r)
            outside = False
            for k in range(first[r], first[r] + length[r]):
                outside = outside or pool[k] == 0
            if size[r] > merge_area and outside:
                continue
            target = np.int64(r)
            at_r = 0
            at_target = 0
            smallest = NO_DISTANCE
            for k in range(first[r], first[r] + length[r]):
                other = np.int64(pool[k])
                if other == r or not alive[other] or stacked[other] or size[other] >= smallest:
                    continue
                met_here = 0  # how often the two outlines meet: merging is safe only where it is once
                met_there = 0
                position = -1
                for m in range(first[r], first[r] + length[r]):
                    met_here += pool[m] == other
                for which in (other, ids + other):
                    _tidy(alias, pool, first, length, which)
                    for m in range(first[which], first[which] + length[which]):
                        if pool[m] == r:
                            met_there += 1 if which < ids else 2
                            if which < ids:
                                position = m - first[which]
                if met_here <= 1 and met_there <= 1:
                    smallest = size[other]
                    target = other
                    at_r = k - first[r]
                    at_target = position
            if target == r or at_target < 0:
                continue
            if used + length[r] + length[target] + length[ids + r] + length[ids + target] > len(pool):
                return False, used
            begin = used
            for k in range(1, length[target]):  # both outlines, opened where they meet
                pool[used] = pool[first[target] + (at_target + k) % length[target]]
                used += 1
            for k in range(1, length[r]):
                pool[used] = pool[first[r] + (at_r + k) % length[r]]
                used += 1
            first[target] = begin
            length[target] = used - begin
            begin = used
            for turn in range(2):
                source = ids + target if turn == 0 else ids + r
                for k in range(first[source], first[source] + length[source]):
                    known = False
                    for m in range(begin, used):
                        known = known or pool[m] == pool[k]
                    if not known:
                        pool[used] = pool[k]
                        used += 1
            first[ids + target] = begin
            length[ids + target] = used - begin
            alias[r] = target
            length[r] = 0
            length[ids + r] = 0
            size[target] += size[r]
            size[r] = 0
            _tidy(alias, pool, first, length, target)
            merging = True
    return True, used
