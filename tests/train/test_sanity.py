"""Early warnings: said once, after patience, and not without reason."""

import pytest

from prnav.contracts import DiscreteActions
from prnav.policy import action_head
from prnav.train.sanity import Bounds, Sanity


def row(step: int, entropy: float = 1.0, kl: float = 0.01, success: float = 0.5, episodes: int = 10) -> dict:
    losses, measures = {"entropy": entropy, "kl": kl}, {"success": success}
    return {"step": step, "episodes": episodes, "losses": losses, "measures": measures}


@pytest.mark.parametrize(
    ("bad", "text"),
    [
        ({"entropy": 0.001}, "tries nothing new; raise ppo.entropy_coefficient"),
        ({"kl": 2.0}, "lower ppo.learning_rate"),
    ],
)
def test_what_lasts_is_said_once(bad, text):
    sanity = Sanity(action_head(DiscreteActions(4)), Bounds(patience=3))
    assert sanity.check(row(1, **bad)) == sanity.check(row(2, **bad)) == []
    [said] = sanity.check(row(3, **bad))
    assert text in said and said.startswith("step 3:")
    assert sanity.check(row(4, **bad)) == []


def test_what_passes_is_not_said():
    sanity = Sanity(action_head(DiscreteActions(4)), Bounds(patience=2))
    for step in range(10):
        assert sanity.check(row(step, entropy=0.001 if step % 2 else 1.0)) == []


def test_no_success_ever():
    sanity = Sanity(action_head(DiscreteActions(4)))
    assert sanity.check(row(1, success=0.0, episodes=1999)) == []
    [said] = sanity.check(row(2, success=0.0, episodes=2000))
    assert "none of the last episodes of 2,000 so far has succeeded" in said
    sanity = Sanity(action_head(DiscreteActions(4)))
    sanity.check(row(1, success=0.1, episodes=100))
    assert sanity.check(row(2, success=0.0, episodes=5000)) == []
