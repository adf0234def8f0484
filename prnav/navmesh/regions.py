"""Cells to regions: Recast's watershed on the distance to the border, then merging and dropping of small regions.

Region 0 means none. Every region is simply shaped enough for its outline (and holes) to become polygons: no region
lies above itself.
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
    above = np.unique(_stacked_pairs(field.start, region, count + 1))
    floors = np.stack([above // (count + 1), above % (count + 1)], axis=1).astype(np.int32)
    floor_start = np.searchsorted(floors[:, 0], np.arange(count + 2)).astype(np.int32)
    stacked = np.zeros(count + 1, np.bool_)
    stacked[floors[floors[:, 0] == floors[:, 1], 0]] = True
    final, count = _merge(
        field.connected, field.area, region, count, floor_start, floors[:, 1].copy(), stacked, min_area, merge_area
    )
    return final[region], count


@njit(cache=True, nogil=True)
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
                offset[:] = 0
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


@njit(cache=True, nogil=True)
def _stacked_pairs(start, region, num_ids):
    """Keys ``a * num_ids + b`` of regions that share a column, with repeats."""
    recent = np.full(1 << 16, -1, np.int64)  # spares most of the repeats
    keys = np.empty(1024, np.int64)
    count = 0
    for column in range(len(start) - 1):
        for i in range(start[column], start[column + 1]):
            for j in range(start[column], start[column + 1]):
                if i == j or region[i] == 0 or region[j] == 0:
                    continue
                key = np.int64(region[i]) * num_ids + region[j]
                slot = (key * 0x9E3779B1 >> 8) & 0xFFFF
                if recent[slot] == key:
                    continue
                recent[slot] = key
                if count == len(keys):
                    old = keys
                    keys = np.empty(2 * count, np.int64)
                    keys[:count] = old
                keys[count] = key
                count += 1
    return keys[:count]


@njit(cache=True, nogil=True)
def _reserve(pool, needed):
    """The pool, or a larger copy of it that holds ``needed`` entries."""
    if needed <= len(pool):
        return pool
    larger = np.empty(2 * needed, np.int32)
    larger[: len(pool)] = pool
    return larger


@njit(cache=True, nogil=True)
def _find(alias, r):
    """The region that r has been merged into."""
    while alias[r] != r:
        alias[r] = alias[alias[r]]
        r = alias[r]
    return r


@njit(cache=True, nogil=True)
def _tidy(alias, pool, first, size, cyclic):
    """Name regions by what they were merged into and drop repeats of neighbours in the list; its new size."""
    kept = 0
    for k in range(first, first + size):
        r = _find(alias, pool[k])
        if kept == 0 or not cyclic or pool[first + kept - 1] != r:
            pool[first + kept] = r
            kept += 1
    if cyclic and kept > 1 and pool[first + kept - 1] == pool[first]:
        kept -= 1
    return kept


@njit(cache=True, nogil=True)
def _can_merge(a, b, pool, link_first, link_size, floors, floor_first, floor_size):
    """Whether a borders b only once, and never lies above or below it."""
    shared = 0
    for k in range(link_first[a], link_first[a] + link_size[a]):
        shared += pool[k] == b
    if shared > 1:
        return False
    for k in range(floor_first[a], floor_first[a] + floor_size[a]):
        if floors[k] == b:
            return False
    return True


@njit(cache=True, nogil=True)
def _around(connected, region, cell, direction, pool, used):
    """Append the regions met along the outline from a cell's border side on; returns the pool and its size."""
    first = used
    i = cell
    side = direction
    met = -1
    for _ in range(4 * len(region) + 4):
        j = connected[i, side]
        beyond = region[j] if j >= 0 else 0
        if beyond != region[i]:
            if beyond != met:
                met = beyond
                pool = _reserve(pool, used + 1)
                pool[used] = met
                used += 1
            side = (side + 1) % 4
        else:
            i = j
            side = (side + 3) % 4
        if i == cell and side == direction:
            break
    if used - first > 1 and pool[used - 1] == pool[first]:
        used -= 1
    return pool, used


@njit(cache=True, nogil=True)
def _merge(connected, area, region, count, floor_start, floor_regions, stacked, min_area, merge_area):
    """New number of each region (0 = dropped), and how many there are.

    Lists of neighbours (in the order met around the outline) live in one pool; a merged region is renamed by an alias
    that is looked up when a list is next read.
    """
    ids = count + 1
    size = np.zeros(ids, np.int64)
    link_first = np.zeros(ids, np.int64)
    link_size = np.zeros(ids, np.int64)
    floor_first = np.empty(ids, np.int64)
    floor_size = np.empty(ids, np.int64)
    for r in range(ids):
        floor_first[r] = floor_start[r]
        floor_size[r] = floor_start[r + 1] - floor_start[r]
    floors = floor_regions
    num_floors = len(floors)
    pool = np.empty(1024, np.int32)
    used = 0
    for i in range(len(region)):
        r = region[i]
        if r == 0:
            continue
        size[r] += 1
        if link_size[r] > 0:
            continue
        for direction in range(4):
            j = connected[i, direction]
            if (region[j] if j >= 0 else 0) != r:
                link_first[r] = used
                pool, used = _around(connected, region, i, direction, pool, used)
                link_size[r] = used - link_first[r]
                break

    alive = np.ones(ids, np.bool_)
    alive[0] = False
    seen = np.zeros(ids, np.bool_)
    group = np.empty(ids, np.int32)
    for r in range(1, ids):  # drop groups of connected regions that are too small
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
            for k in range(link_first[here], link_first[here] + link_size[here]):
                other = pool[k]
                if other != 0 and not seen[other]:
                    seen[other] = True
                    group[members] = other
                    members += 1
        if total < min_area:
            for k in range(members):
                alive[group[k]] = False
                size[group[k]] = 0

    alias = np.arange(ids).astype(np.int32)
    merging = True
    while merging:
        merging = False
        for r in range(1, ids):
            if not alive[r] or alias[r] != r or stacked[r] or size[r] == 0:
                continue
            link_size[r] = _tidy(alias, pool, link_first[r], link_size[r], True)
            floor_size[r] = _tidy(alias, floors, floor_first[r], floor_size[r], False)
            outside = False
            for k in range(link_first[r], link_first[r] + link_size[r]):
                outside = outside or pool[k] == 0
            if size[r] > merge_area and outside:
                continue
            target = r
            smallest = NO_DISTANCE
            for k in range(link_first[r], link_first[r] + link_size[r]):
                other = pool[k]
                if other == r or not alive[other] or stacked[other] or size[other] >= smallest:
                    continue
                link_size[other] = _tidy(alias, pool, link_first[other], link_size[other], True)
                floor_size[other] = _tidy(alias, floors, floor_first[other], floor_size[other], False)
                if _can_merge(r, other, pool, link_first, link_size, floors, floor_first, floor_size) and _can_merge(
                    other, r, pool, link_first, link_size, floors, floor_first, floor_size
                ):
                    smallest = size[other]
                    target = other
            if target == r:
                continue
            at_target = -1
            at_r = -1
            for k in range(link_size[target]):
                if at_target < 0 and pool[link_first[target] + k] == r:
                    at_target = k
            for k in range(link_size[r]):
                if at_r < 0 and pool[link_first[r] + k] == target:
                    at_r = k
            if at_target < 0 or at_r < 0:
                continue
            first = used
            pool = _reserve(pool, used + link_size[target] + link_size[r])
            for k in range(1, link_size[target]):  # both outlines, opened where they meet
                pool[used] = pool[link_first[target] + (at_target + k) % link_size[target]]
                used += 1
            for k in range(1, link_size[r]):
                pool[used] = pool[link_first[r] + (at_r + k) % link_size[r]]
                used += 1
            alias[r] = target
            link_first[target] = first
            link_size[target] = _tidy(alias, pool, first, used - first, True)
            link_size[r] = 0
            if floor_size[r] > 0:
                floors = _reserve(floors, num_floors + floor_size[target] + floor_size[r])
                first = num_floors
                for owner in (target, r):
                    for k in range(floor_first[owner], floor_first[owner] + floor_size[owner]):
                        known = False
                        for m in range(first, num_floors):
                            known = known or floors[m] == floors[k]
                        if not known:
                            floors[num_floors] = floors[k]
                            num_floors += 1
                floor_first[target] = first
                floor_size[target] = num_floors - first
                floor_size[r] = 0
            size[target] += size[r]
            size[r] = 0
            merging = True

    final = np.zeros(ids, np.int32)
    number = np.zeros(ids, np.int32)
    count = 0
    for r in range(1, ids):
        root = _find(alias, r)
        if alive[root]:
            if number[root] == 0:
                count += 1
                number[root] = count
            final[r] = number[root]
    return final, count
