"""Speed of training: the paper's transformer beside plain torch, and where the quick-start's time goes."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import torch
from torch import Tensor, nn

from prnav.bench.ranks import measure_ranks
from prnav.bench.table import Row, device_name, rates_by_turns, row
from prnav.contracts import DiscreteActions, ObservationSpec
from prnav.domains.navigation.pointgoal import PointGoalNavVectorEnv
from prnav.policy import Categorical, Policy, PolicyConfig, build_policy
from prnav.resources import available_cores
from prnav.train import PPOConfig, RunFolder, Trainer, group_sizes, load_train_config, ppo
from prnav.train.learner import Learner
from prnav.train.rollout import Rollout

SPECS = {
    "photoreceptors": ObservationSpec((2, 16, 3), "receptors"),
    "design": ObservationSpec((2, 7), "design"),
    "gps": ObservationSpec((2,), "vector"),
    "compass": ObservationSpec((1,), "vector"),
    "pointgoal": ObservationSpec((2,), "vector"),
}
ACTIONS = 4
CONFIG = PolicyConfig(encoder="transformer", width=64, lstm_hidden=128)
STEPS, ENVIRONMENTS = 64, 16
EPISODE = 40
"""Mean length of the episodes in the made-up rollout."""


def measure_train(seconds: float = 10.0) -> list[Row]:
    """Rows of all that is measured, each for about so many seconds of CPU time."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        plain, ours = rates_by_turns((plain_update(), our_update()), seconds)
    finally:
        torch.set_num_threads(threads)
    rows = [
        row("train", "transformer_plain_torch", plain, "steps/s"),
        row("train", "transformer", ours, "steps/s"),
        row("train", "transformer_gain", ours / plain, "x"),
    ]
    return rows + quick_start(seconds) + measure_ranks(seconds)


def made_up_rollout(policy: Policy) -> Rollout:
    """Random observations, actions and advantages in episodes of random lengths."""
    generator = torch.Generator().manual_seed(0)
    rollout = Rollout(STEPS, ENVIRONMENTS, policy)
    for value in rollout.observations.values():
        value.uniform_(generator=generator)
    for name in ("rewards", "values", "log_probs"):
        rollout[name].normal_(generator=generator)
    rollout["actions"].random_(ACTIONS, generator=generator)
    rollout["starts"].bernoulli_(1.0 / EPISODE, generator=generator)
    rollout["advantages"] = torch.randn(STEPS, ENVIRONMENTS, generator=generator)
    rollout["returns"] = torch.randn(STEPS, ENVIRONMENTS, generator=generator)
    return rollout


def our_update() -> Callable[[], int]:
    """Acting through a rollout and learning from it as the trainer does, without a simulator."""
    policy = build_policy(CONFIG, SPECS, DiscreteActions(ACTIONS))
    rollout = made_up_rollout(policy)
    learner = Learner(policy, 0, 1, 1e-5)
    config = PPOConfig()

    def work() -> int:
        state = rollout.state
        with torch.no_grad():
            for t in range(STEPS):
                seen = {key: value[t] for key, value in rollout.observations.items()}
                output = policy.step(seen, rollout["actions"][t], rollout["starts"][t], state)
                state = output.state
                output.distribution.mode()
        learner.update(rollout, partial(ppo.ppo_loss, config=config), config.epochs, 1, config.learning_rate, 0.5)
        return STEPS * ENVIRONMENTS

    return work


class PlainPolicy(nn.Module):
    """What one would write first: torch's own transformer layers, and its LSTM called step by step between resets."""

    def __init__(self) -> None:
        super().__init__()
        width, hidden = CONFIG.width, CONFIG.lstm_hidden
        _, receptors, _ = SPECS["photoreceptors"].shape
        self.positions = nn.Parameter(0.02 * torch.randn(receptors, CONFIG.position_width))
        self.readout = nn.Parameter(0.02 * torch.randn(width))
        self.receptor = nn.Linear(3 + 7 + CONFIG.position_width, width)
        self.vector = nn.Linear(5, width)
        layer = nn.TransformerEncoderLayer(
            width, CONFIG.transformer_heads, CONFIG.feedforward, 0.0, "gelu", batch_first=True, norm_first=True
        )
        self.layers = nn.TransformerEncoder(layer, CONFIG.transformer_layers, enable_nested_tensor=False)
        self.lstm = nn.LSTM(width, hidden, CONFIG.lstm_layers)
        self.actor, self.critic = nn.Linear(hidden, ACTIONS), nn.Linear(hidden, 1)

    def encode(self, seen: dict[str, Tensor]) -> Tensor:
        """Encoding (B, D)."""
        readings = seen["photoreceptors"]
        batch, sensors, receptors, _ = readings.shape
        designs = seen["design"][:, :, None].expand(-1, -1, receptors, -1)
        tokens = self.receptor(torch.cat([readings, designs, self.positions.expand(batch, sensors, -1, -1)], dim=-1))
        vector = self.vector(torch.cat([seen["gps"], seen["compass"], seen["pointgoal"]], dim=-1))
        readout = self.readout.expand(batch, 1, -1)
        return self.layers(torch.cat([readout, vector[:, None], tokens.flatten(1, 2)], dim=1))[:, 0]

    def forward(
        self, seen: dict[str, Tensor], starts: Tensor, state: tuple[Tensor, Tensor]
    ) -> tuple[Tensor, Tensor, tuple[Tensor, Tensor]]:
        """Logits (T, N, A), values (T, N) and the state after rows (T, N, ...)."""
        steps, count = starts.shape
        encoded = self.encode({key: value.flatten(0, 1) for key, value in seen.items()}).view(steps, count, -1)
        outputs = []
        for t in range(steps):
            keep = (~starts[t]).float()[None, :, None]
            output, state = self.lstm(encoded[t : t + 1], (state[0] * keep, state[1] * keep))
            outputs.append(output)
        joined = torch.cat(outputs)
        return self.actor(joined), self.critic(joined)[..., 0], state


def plain_update() -> Callable[[], int]:
    """The same work as :func:`our_update` in plain torch."""
    rollout = made_up_rollout(build_policy(CONFIG, SPECS, DiscreteActions(ACTIONS)))
    policy = PlainPolicy()
    optimizer = torch.optim.Adam(policy.parameters(), lr=2.5e-4, eps=1e-5)
    config = PPOConfig()
    zeros = torch.zeros(CONFIG.lstm_layers, ENVIRONMENTS, CONFIG.lstm_hidden)

    def work() -> int:
        state = (zeros, zeros)
        with torch.no_grad():
            for t in range(STEPS):
                seen = {key: value[t : t + 1] for key, value in rollout.observations.items()}
                logits, _, state = policy(seen, rollout["starts"][t : t + 1], state)
                logits.argmax(dim=-1)
        for _ in range(config.epochs):
            logits, values, _ = policy(rollout.observations, rollout["starts"], (zeros, zeros))
            loss, _ = ppo.ppo_loss(Categorical(logits), values, rollout.arrays, config)
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(policy.parameters(), config.max_grad_norm)
            optimizer.step()
        return STEPS * ENVIRONMENTS

    return work


def quick_start(seconds: float) -> list[Row]:
    """The quick-start preset end to end on all cores by the clock, and its CPU time by what it is spent on.

    The oracle acts, so that episodes are as long as a trained agent's.
    """
    config = load_train_config("quickstart", ("env.max_scenes=12", "imitation.expert_end=1.0"))
    groups: list[PointGoalNavVectorEnv] = []
    for size in group_sizes(config.num_envs, config.groups):
        groups.append(PointGoalNavVectorEnv(size, config.env, groups[0].slots.source if groups else None))
    spent = {"collecting": 0.0, "learning": 0.0}
    with tempfile.TemporaryDirectory() as folder:
        trainer = Trainer(config, groups, RunFolder(Path(folder) / "run"))
        steps, begin = 0, 0.0
        for update in range(10_000):
            if update == 1:  # the first one compiles
                steps, begin, spent = 0, time.perf_counter(), dict.fromkeys(spent, 0.0)
            clocks = [time.process_time()]
            trainer.collect(1.0)
            trainer.estimate_advantages()
            clocks.append(time.process_time())
            trainer.update("imitation")
            clocks.append(time.process_time())
            spent["collecting"] += clocks[1] - clocks[0]
            spent["learning"] += clocks[2] - clocks[1]
            steps += trainer.rollout.steps * trainer.rollout.environments
            if update and sum(spent.values()) > seconds:
                break
        elapsed = time.perf_counter() - begin
        trainer.close()
    device = device_name(available_cores())
    rows = [row("train", "quickstart_end_to_end_by_the_clock", steps / elapsed, "steps/s", device)]
    return rows + [row("train", f"quickstart_{name}", 1e6 * value / steps, "us/step") for name, value in spent.items()]
