"""Real-valued actions and mini-batches of single steps, through the trainer's own path."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from reach_env import GymnasiumEnv, ReachEnv
from toy_run import toy_config

from prnav.contracts import BatchEnv, BoxActions, DiscreteActions, ObservationSpec
from prnav.policy import MEMORIES, PolicyConfig, action_head, build_policy
from prnav.train import ImitationConfig, PPOConfig, RunFolder, TrainConfig, Trainer, load_policy, ppo, read_metrics
from prnav.train.crew import Crew
from prnav.train.learner import Learner
from prnav.train.rollout import Rollout
from prnav.train.sanity import Bounds, Sanity
from prnav.train.stored_specs import specs_of, stored_specs

BOX = BoxActions((-1.0, 0.0), (1.0, 4.0))
STACK = PolicyConfig(encoder="state", width=32, memory="stack", frames=3, head_hidden=32)


def reach_config(**changes) -> TrainConfig:
    ppo_config = PPOConfig(
        rollout_steps=24, learning_rate=3e-3, epochs=4, mini_batch_steps=384, entropy_coefficient=0.0, discount=0.9
    )
    values = {"num_envs": 64, "ppo": ppo_config, "policy": STACK, "checkpoint_steps": 10**6}
    return toy_config(**{**values, **changes})


@pytest.fixture
def reach(tmp_path):
    """Function (config, folder name) -> trainer on the task of real-valued actions."""
    made = []

    def make(config, name="run", **arguments):
        half = config.num_envs // 2
        trainer = Trainer(
            config, [ReachEnv(half), ReachEnv(config.num_envs - half)], RunFolder(tmp_path / name), **arguments
        )
        made.append(trainer)
        return trainer

    yield make
    for trainer in made:
        trainer.close()


def trace(folder: Path) -> list[dict]:
    return [{key: value for key, value in row.items() if key != "times"} for row in read_metrics(folder)]


def test_toys_are_batched_environments():
    assert isinstance(ReachEnv(2), BatchEnv) and isinstance(GymnasiumEnv("Pendulum-v1", 2), BatchEnv)


@pytest.mark.parametrize("memory", ["stack", "lstm"])
def test_ppo_learns_a_vector_to_remember(reach, memory):
    policy = replace(STACK, memory=memory, lstm_hidden=32, lstm_layers=1)
    changes = {"mini_batch_steps": 0, "mini_batches": 4} if memory == "lstm" else {}
    config = reach_config(total_steps=90 * 64 * 24, policy=policy)
    trainer = reach(replace(config, ppo=replace(config.ppo, linear_decay=True, **changes)))
    trainer.train()
    rows = trace(trainer.folder.path)
    assert rows[0]["measures"]["reward"] < -1.0  # a standard deviation of half the range, and a place of its own
    assert rows[-1]["measures"]["reward"] > -0.35
    assert rows[-1]["losses"]["action_std"] < rows[0]["losses"]["action_std"]
    assert rows[-1]["losses"]["entropy"] < rows[0]["losses"]["entropy"]


def test_a_warm_start_imitates_vectors(reach):
    imitation = ImitationConfig(steps=40 * 64 * 24, learning_rate=3e-3, epochs=2, mini_batches=4, expert_end=1.0)
    trainer = reach(reach_config(total_steps=40 * 64 * 24, imitation=imitation))
    trainer.train()
    losses = [row["losses"] for row in trace(trainer.folder.path)]
    assert losses[-1]["imitation_loss"] < 0.2 * losses[0]["imitation_loss"]
    assert losses[-1]["action_std"] == 1.0  # what PPO will explore with
    assert torch.equal(trainer.rollout["actions"], trainer.rollout["expert"])


@pytest.mark.parametrize("memory", ["stack", "none", "lstm"])
def test_a_resumed_run_equals_an_unbroken_one(reach, memory):
    policy = replace(STACK, memory=memory, lstm_hidden=8)
    ppo_config = PPOConfig(rollout_steps=10, epochs=2, mini_batches=3)
    config = reach_config(total_steps=8 * 60, num_envs=6, policy=policy, ppo=ppo_config, checkpoint_steps=60)
    config = replace(config, imitation=ImitationConfig(steps=120))
    unbroken = reach(config, "unbroken")
    unbroken.train()
    first = reach(replace(config, total_steps=4 * 60), "broken")
    first.train()
    first.close()
    second = reach(config, "broken")
    second.begin()
    assert second.step == 240
    second.train()
    assert trace(second.folder.path) == trace(unbroken.folder.path)
    for (name, a), b in zip(second.policy.state_dict().items(), unbroken.policy.state_dict().values(), strict=True):
        assert a.equal(b), name
    loaded, _ = load_policy(second.folder)
    assert loaded.action_spec == BOX and loaded.observation_specs == second.policy.observation_specs


def gaussian_by_hand(output: np.ndarray, log_std: np.ndarray, actions: np.ndarray):
    """Log densities and entropies in float64, from the actor's output in units of the box."""
    middle, half = np.array([0.0, 2.0]), np.array([1.0, 2.0])
    mean, std = middle + half * output, half * np.exp(log_std)
    density = np.exp(-((actions - mean) ** 2) / (2 * std**2)) / np.sqrt(2 * np.pi * std**2)
    return np.log(density).sum(axis=-1), (0.5 * np.log(2 * np.pi * np.e * std**2)).sum(axis=-1) * np.ones(len(actions))


def loss_by_hand(
    network: dict[str, np.ndarray], x: np.ndarray, batch: dict[str, np.ndarray], config: PPOConfig
) -> dict:
    output = x @ network["mean.weight"].T + network["mean.bias"]
    log_probs, entropy = gaussian_by_hand(output, network["log_std"], batch["actions"])
    ratio = np.exp(log_probs - batch["log_probs"])
    policy, clipped = 0.0, 0
    for r, advantage in zip(ratio, batch["advantages"], strict=True):
        bounded = min(max(r, 1 - config.clip), 1 + config.clip)
        policy -= min(r * advantage, bounded * advantage) / len(ratio)
        clipped += abs(r - 1) > config.clip
    value = 0.0
    for now, old, target in zip(batch["now"], batch["values"], batch["returns"], strict=True):
        kept = old + min(max(now - old, -config.value_clip), config.value_clip) if config.value_clip else now
        value += 0.5 * max((now - target) ** 2, (kept - target) ** 2) / len(ratio)
    total = policy + config.value_coefficient * value - config.entropy_coefficient * entropy.mean()
    kl = np.mean(ratio - 1 - np.log(ratio))
    parts = {"policy_loss": policy, "value_loss": value, "entropy": entropy.mean(), "kl": kl}
    return {"total": total, **parts, "clip_fraction": clipped / len(ratio)}


@pytest.mark.parametrize("value_clip", [0.0, 0.3])
def test_losses_and_gradients_agree_with_an_independent_implementation_in_float64(value_clip):
    """Losses to 1e-9; gradients against central differences of the other implementation."""
    config = PPOConfig(entropy_coefficient=0.02, value_coefficient=0.7, value_clip=value_clip)
    rng = np.random.default_rng(0)
    x = rng.normal(size=(40, 5))
    head = action_head(BOX)
    torch.manual_seed(0)
    actor = head.actor(5, hidden=0).double()
    with torch.no_grad():
        actor.log_std += torch.tensor([-0.4, 0.3])
        actor.mean.weight += 0.3 * torch.randn(2, 5, dtype=torch.float64)
    arrays = {name: rng.normal(size=40) for name in ("values", "advantages", "returns", "now")}
    arrays["actions"] = rng.normal(size=(40, 2)) * [1.0, 2.0] + [0.0, 2.0]
    network = {name: value.detach().numpy().copy() for name, value in actor.state_dict().items()}
    old = gaussian_by_hand(x @ network["mean.weight"].T, network["log_std"], arrays["actions"])[0]
    arrays["log_probs"] = old + rng.normal(size=40) * 0.2
    batch = {name: torch.from_numpy(value) for name, value in arrays.items()}

    distribution = head.distribution(actor(torch.from_numpy(x)))
    total, parts = ppo.ppo_loss(distribution, batch["now"], batch, config)
    expected = loss_by_hand(network, x, arrays, config)
    assert 0.1 < expected["clip_fraction"] < 0.9
    assert total.item() == pytest.approx(expected["total"], abs=1e-9)
    for name in ("policy_loss", "value_loss", "entropy", "kl"):
        assert parts[name].item() == pytest.approx(expected[name], abs=1e-9), name
    assert parts["clip_fraction"].item() == pytest.approx(expected["clip_fraction"], abs=1e-6)

    total.backward()
    for name, parameter in actor.named_parameters():
        for index in np.ndindex(parameter.shape):
            ends = []
            for shift in (1e-6, -1e-6):
                moved = {key: value.copy() for key, value in network.items()}
                moved[name][index] += shift
                ends.append(loss_by_hand(moved, x, arrays, config)["total"])
            assert parameter.grad[index].item() == pytest.approx((ends[0] - ends[1]) / 2e-6, abs=1e-7)


def collected(memory: str, steps: int = 13, environments: int = 6):
    envs = ReachEnv(environments)
    config = replace(STACK, memory=memory, lstm_hidden=8, frames=4)
    policy = build_policy(config, envs.observation_specs, envs.action_spec)
    crew = Crew([envs], policy, seed=0, threads=1)
    rollout = Rollout(steps, environments, policy)
    for _ in range(2):  # the second one continues from the first one's state
        crew.collect(rollout, None)
    rollout["advantages"], rollout["returns"] = torch.randn(steps, environments), torch.randn(steps, environments)
    return policy, rollout


@pytest.mark.parametrize("memory", sorted(MEMORIES))
def test_learning_sees_what_acting_saw(memory):
    policy, rollout = collected(memory)
    with torch.no_grad():
        distribution, values = policy.sequence(
            rollout.observations, rollout["previous_actions"], rollout["starts"], rollout.state
        )
    torch.testing.assert_close(values, rollout["values"], atol=1e-5, rtol=0)
    log_probs = distribution.log_prob(rollout["actions"])
    torch.testing.assert_close(log_probs, rollout["log_probs"], atol=1e-5, rtol=0)
    assert rollout["expert"].isnan().all()


@pytest.mark.parametrize("memory", sorted(MEMORIES))
def test_gradients_do_not_depend_on_threads_and_mini_batches_cover_everything_once(memory):
    policy, rollout = collected(memory)

    def gradients(threads: int, mini_batches: int) -> list[torch.Tensor]:
        learner = Learner(policy, seed=0, threads=threads, epsilon=1e-5)
        before = [parameter.detach().clone() for parameter in learner.parameters]
        sums = [torch.zeros_like(parameter) for parameter in learner.parameters]
        rows = []

        def loss(distribution, values, batch):
            rows.append(len(values))
            return ppo.ppo_loss(distribution, values, batch, PPOConfig())

        step = learner.optimizer.step

        def add():
            for total, parameter in zip(sums, learner.parameters, strict=True):
                total += parameter.grad / mini_batches

        learner.optimizer.step = add
        learner.update(rollout, loss, 1, mini_batches, 1e-9, 1e9)
        assert sum(rows) == 13 * 6 and step is not None
        for parameter, value in zip(learner.parameters, before, strict=True):
            assert torch.equal(parameter, value)
        return sums

    whole = gradients(1, 1)
    for threads, mini_batches in ((3, 1), (1, 3), (2, 6)):
        for a, b in zip(whole, gradients(threads, mini_batches), strict=True):
            torch.testing.assert_close(a, b, atol=2e-6, rtol=1e-4)
    for a, b in zip(gradients(2, 3), gradients(2, 3), strict=True):
        assert torch.equal(a, b)


PAPER = """
import resource, sys
sys.path.insert(0, sys.argv[1])
import torch
from prnav.contracts import BoxActions, ObservationSpec
from prnav.policy import PolicyConfig, build_policy
from prnav.train import PPOConfig, ppo
from prnav.train.learner import Learner
from prnav.train.rollout import Rollout

config = PPOConfig(rollout_steps=10_000, mini_batch_steps=1000, epochs=1)
specs = {"eyes": ObservationSpec((8, 16, 3), "receptors"), "design": ObservationSpec((8, 7), "design")}
policy = build_policy(
    PolicyConfig(encoder="compact", width=16, memory="stack"), specs, BoxActions((-1.0,) * 6, (1.0,) * 6)
)
generator = torch.Generator().manual_seed(0)
rollout = Rollout(10_000, 10, policy)
for array in (*rollout.observations.values(), *(rollout[name] for name in ("actions", "values", "log_probs"))):
    array.uniform_(generator=generator)
rollout["starts"].bernoulli_(0.002, generator=generator)
rollout["advantages"], rollout["returns"] = rollout["values"].clone(), rollout["values"].clone()
sizes = []
def loss(distribution, values, batch):
    sizes.append(len(values))
    return ppo.ppo_loss(distribution, values, batch, config)
learner = Learner(policy, 0, 1, 1e-5)
peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
before = peak()
learner.update(rollout, loss, 1, config.parts(10), 1e-4, 0.5)
assert sizes == [1000] * 100, sizes
megabytes = sum(v.numel() * v.element_size() for v in rollout.observations.values()) >> 20
print(megabytes, peak() - before)
"""


def test_the_papers_rollout_is_learnt_within_bounded_memory():
    """10 environments x 10,000 steps in mini-batches of 1,000, three frames: no second copy of the observations."""
    command = [sys.executable, "-c", PAPER, str(Path(__file__).parent)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    observations, grown = map(int, done.stdout.split())
    assert observations > 160 and grown < 0.5 * observations


def test_mini_batches_that_cannot_be_made_are_refused():
    lstm, stack = PolicyConfig(), PolicyConfig(memory="stack")
    sizes = PPOConfig(rollout_steps=10_000, mini_batch_steps=1000)
    assert sizes.parts(10) == 100
    assert TrainConfig(num_envs=10, policy=stack, ppo=sizes).ppo is sizes
    with pytest.raises(
        ValueError, match=r"ppo.mini_batch_steps is 1000 and ppo.rollout_steps 10000; .* policy.memory = 'stack'"
    ):
        TrainConfig(num_envs=10, policy=lstm, ppo=sizes)
    with pytest.raises(ValueError, match=r"ppo.mini_batches is 11; it must be at most num_envs \(10\)"):
        TrainConfig(num_envs=10, policy=lstm, ppo=PPOConfig(mini_batches=11))
    assert TrainConfig(num_envs=10, policy=stack, ppo=PPOConfig(mini_batches=11)).num_envs == 10
    with pytest.raises(ValueError, match="ppo.mini_batches is 641; it must be at most 640, the steps of a rollout"):
        TrainConfig(num_envs=10, policy=stack, ppo=PPOConfig(mini_batches=641))
    with pytest.raises(ValueError, match="mini_batches is 2 and mini_batch_steps 10; give one of them"):
        PPOConfig(mini_batches=2, mini_batch_steps=10)
    with pytest.raises(ValueError, match="mini_batch_steps is -1; it must be at least 1, or 0 to be off"):
        PPOConfig(mini_batch_steps=-1)


def test_a_narrow_gaussian_is_no_alarm_and_one_that_has_collapsed_is():
    sanity = Sanity(action_head(BOX), Bounds(patience=2))
    row = {"step": 1, "episodes": 1, "measures": {}, "losses": {"entropy": -7.0, "kl": 0.0, "action_std": 0.1}}
    assert sanity.check(row) == sanity.check(row) == sanity.check(row) == []
    row["losses"]["action_std"] = 0.001
    assert sanity.check(row) == []
    [said] = sanity.check(row)
    assert (
        "an action's standard deviation has been below 0.020 of half its range for 2 updates: it tries nothing" in said
    )


def test_specs_go_through_a_checkpoint_and_those_of_the_first_version_are_understood():
    specs = {"eyes": ObservationSpec((2, 16, 3), "receptors"), "frame": ObservationSpec((1, 8, 8, 3), "image", "uint8")}
    assert specs_of(stored_specs(specs, BOX)) == (specs, BOX)
    first = {
        "shapes": {"photoreceptors": [2, 16, 3], "design": [2, 7], "gps": [2], "camera": [1, 8, 8, 3]},
        "actions": 4,
    }
    found, actions = specs_of(first)
    assert actions == DiscreteActions(4)
    assert [found[name].kind for name in first["shapes"]] == ["receptors", "design", "vector", "image"]
    assert found["camera"].dtype == "uint8" and found["gps"].shape == (2,)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_pendulum_is_solved(tmp_path, seed):
    """Mean return of ten evaluation episodes after 300,000 steps at most."""
    from pendulum import CONFIG, train

    assert CONFIG.total_steps <= 300_000
    assert train(tmp_path / "run", seed) >= -300.0
