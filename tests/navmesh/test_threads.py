"""Every public question, asked from four threads at once, has the answer that it has from one."""

import pickle
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from rooms import random_room

from prnav.navmesh import GoalFields, NavMeshSet

THREADS = 4


def hammer(question, cases, rounds=1):
    """Cases whose answers differ between one thread and four that start together; () where none do."""
    want = [question(case) for case in cases]
    gate = threading.Barrier(THREADS)

    def ask(first):
        gate.wait()
        wrong = []
        for _ in range(rounds):
            for k in range(len(cases)):
                i = (k + first) % len(cases)
                got = question(cases[i])
                if not all(np.array_equal(g, w, equal_nan=True) for g, w in zip(got, want[i], strict=True)):
                    wrong.append(i)
        return wrong

    with ThreadPoolExecutor(THREADS) as pool:
        parts = [pool.submit(ask, len(cases) // THREADS * i) for i in range(THREADS)]
        return sorted({i for part in parts for i in part.result()})


def navmesh_questions(navmesh):
    return {
        "snap": lambda a, b: (navmesh.snap(a),),
        "island_of": lambda a, b: (navmesh.island_of(a),),
        "is_navigable": lambda a, b: (navmesh.is_navigable(a),),
        "random_points": lambda a, b: (navmesh.random_points(5, int(1e6 * a[0, 0])),),
        "step": lambda a, b: navmesh.step(a, b),
        "distances": lambda a, b: (navmesh.distances(a, b),),
        "distance": lambda a, b: (navmesh.distance(a[0], b[0]),),
        "path": lambda a, b: (navmesh.path(a[0], b[0]),),
        "clearance": lambda a, b: (navmesh.clearance(a),),
        "located_distances": lambda a, b: (navmesh.located_distances(navmesh.locate(a), navmesh.locate(b)),),
        "in_sight": lambda a, b: (navmesh.in_sight(navmesh.locate(a), navmesh.locate(b)),),
        "topdown": lambda a, b: (navmesh.topdown(float(a[0, 1]), 0.5),),
    }


@pytest.fixture(scope="module")
def floors():
    return [random_room(seed, size=12)[0] for seed in (3, 4, 5)]


def pairs(navmesh, count, rows=4):
    points = navmesh.random_points(2 * rows * count, 7).reshape(count, 2, rows, 3)
    return [(a, b) for a, b in points]


@pytest.mark.parametrize("name", navmesh_questions(random_room(3, size=4)[0]))
def test_a_navmesh_answers_four_threads_as_one(floors, name):
    question = navmesh_questions(floors[0])[name]
    assert hammer(lambda case: question(*case), pairs(floors[0], 100)) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", navmesh_questions(random_room(3, size=4)[0]))
def test_ten_thousand_calls_from_four_threads(floors, name):
    question = navmesh_questions(floors[0])[name]
    assert hammer(lambda case: question(*case), pairs(floors[0], 500), rounds=20) == []


def test_a_set_answers_four_threads_as_one(floors):
    together = NavMeshSet(floors)
    scenes = np.array([0, 1, 2, 1])
    cases = pairs(floors[0], 100)
    assert hammer(lambda case: (together.distances(scenes, *case),), cases) == []
    assert hammer(lambda case: together.step(scenes, *case), cases) == []


def test_goal_fields_answer_while_other_slots_are_prepared(floors):
    fields = GoalFields(NavMeshSet(floors), 8)
    points = floors[0].random_points(200, 1)

    def prepare_and_ask(thread):
        """Each thread prepares two slots of its own over and over, and asks about them."""
        wrong = 0
        slots = [2 * thread, 2 * thread + 1]
        for i in range(60):
            goals = points[[i, i + 60]]
            fields.prepare(slots, [0, 0], goals)
            got = fields.query(slots, points[[i + 100, i + 101]])[0]
            want = floors[0].distances(goals, points[[i + 100, i + 101]])
            wrong += not np.allclose(got, want, rtol=0, atol=1e-9, equal_nan=True)
        return wrong

    with ThreadPoolExecutor(THREADS) as pool:
        assert list(pool.map(prepare_and_ask, range(THREADS))) == [0] * THREADS


def test_goal_fields_answer_four_threads_as_one(floors):
    fields = GoalFields(NavMeshSet(floors), 2)
    fields.prepare([0, 1], [0, 0], floors[0].random_points(2, 3))
    cases = [a[:2] for a, _ in pairs(floors[0], 200)]
    assert hammer(lambda points: fields.query([0, 1], points), cases) == []


def test_navmeshes_and_fields_can_be_pickled(floors):
    points = floors[0].random_points(20, 0)
    want = floors[0].distances(points[:10], points[10:])
    assert np.array_equal(pickle.loads(pickle.dumps(floors[0])).distances(points[:10], points[10:]), want)
    fields = GoalFields(NavMeshSet(floors[:1]), 1)
    fields.prepare([0], [0], points[:1])
    again = pickle.loads(pickle.dumps(fields))
    assert np.array_equal(again.query([0], points[1:2])[0], fields.query([0], points[1:2])[0])
