"""A photoreceptor agent under Stable-Baselines3's recurrent PPO: ``pip install sb3-contrib``, then run this file."""

import argparse

import gymnasium

import prnav  # noqa: F401 (registers the environments)
from prnav.domains.navigation.env import load_source
from prnav.domains.navigation.pointgoal import PointGoalEnvConfig


def main(steps: int = 2048, num_envs: int = 4, rollout: int = 64):
    """Train for so many steps; the model."""
    from sb3_contrib import RecurrentPPO
    from stable_baselines3.common.monitor import Monitor
    from stable_baselines3.common.vec_env import DummyVecEnv

    config = PointGoalEnvConfig(scenes="val", max_scenes=2, rays_per_receptor=1)
    source = load_source(config)  # homes are loaded once and shared
    envs = DummyVecEnv(
        [lambda: Monitor(gymnasium.make("prnav/PointGoalNav-v0", config=config, source=source))] * num_envs
    )
    envs.seed(0)
    model = RecurrentPPO(
        "MultiInputLstmPolicy",
        envs,
        n_steps=rollout,
        batch_size=rollout * num_envs,
        n_epochs=2,
        policy_kwargs={"lstm_hidden_size": 64},
        seed=0,
        device="cpu",
        verbose=1,
    )
    return model.learn(steps)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=2048)
    main(parser.parse_args().steps)
