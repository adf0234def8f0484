"""Tasks with real-valued actions: one that needs memory, and Gymnasium's, as batched environments."""

import gymnasium
import numpy as np

from prnav.contracts import BoxActions, ObservationSpec


class ReachEnv:
    """A place in the plane is shown at the first step of an episode, and must be named two steps later.

    The reward of the last step is the square of what is left, negative; the action at other steps is free.
    """

    LENGTH = 3

    def __init__(self, num_envs: int = 8) -> None:
        self.num_envs = num_envs
        self.observation_specs = {"place": ObservationSpec((3,), "vector")}
        self.action_spec = BoxActions((-1.0, 0.0), (1.0, 4.0))

    def reset(self, *, seed=None, options=None):
        self.generator = np.random.Generator(np.random.PCG64(seed))
        self.time = self.generator.integers(0, self.LENGTH, self.num_envs)
        self.place = self._places()
        return self._observe(), {}

    def step(self, actions):
        assert actions.shape == (self.num_envs, 2) and actions.dtype == np.float32
        assert (actions >= [-1.0, 0.0]).all() and (actions <= [1.0, 4.0]).all()
        last = self.time == self.LENGTH - 1
        left = (actions - self.place) / [1.0, 2.0]
        rewards = np.where(last, -(left**2).sum(axis=1), 0.0)
        self.time = self.time + 1
        info = {"final_obs": self._observe(), "final_info": {"reward": rewards}} if last.any() else {}
        self.place = np.where(last[:, None], self._places(), self.place)
        self.time[last] = 0
        return self._observe(), rewards, last, np.zeros_like(last), info

    def expert_actions(self):
        return self.place

    def snapshot(self):
        return {"time": self.time.copy(), "place": self.place.copy(), "generator": self.generator.bit_generator.state}

    def restore(self, state):
        self.time, self.place = state["time"].copy(), state["place"].copy()
        self.generator = np.random.Generator(np.random.PCG64())
        self.generator.bit_generator.state = state["generator"]

    def _places(self):
        return self.generator.uniform([-0.8, 0.4], [0.8, 3.6], (self.num_envs, 2))

    def _observe(self):
        shown = (self.time == 0)[:, None]
        scaled = (self.place - [0.0, 2.0]) / [1.0, 2.0]
        return {"place": np.concatenate([np.where(shown, scaled, 0.0), shown], axis=1).astype(np.float32)}


class GymnasiumEnv:
    """One of Gymnasium's own environments with vectors in and out, as a BatchEnv."""

    def __init__(self, name: str, num_envs: int) -> None:
        mode = gymnasium.vector.AutoresetMode.SAME_STEP
        self.envs = gymnasium.make_vec(
            name, num_envs, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode}
        )
        self.num_envs = num_envs
        self.observation_specs = {"state": ObservationSpec(self.envs.single_observation_space.shape, "vector")}
        space = self.envs.single_action_space
        self.action_spec = BoxActions(tuple(space.low.tolist()), tuple(space.high.tolist()))

    def reset(self, *, seed=None, options=None):
        observations, info = self.envs.reset(seed=seed)
        self.totals = np.zeros(self.num_envs)
        return {"state": observations.astype(np.float32)}, info

    def step(self, actions):
        observations, rewards, terminated, truncated, info = self.envs.step(actions)
        self.totals += rewards
        over = terminated | truncated
        if over.any():
            final = np.stack(
                [
                    np.zeros_like(row) if last is None else last
                    for row, last in zip(observations, info["final_obs"], strict=True)
                ]
            )
            info = {"final_obs": {"state": final.astype(np.float32)}, "final_info": {"return": self.totals.copy()}}
            self.totals[over] = 0.0
        return {"state": observations.astype(np.float32)}, rewards, terminated, truncated, info

    def snapshot(self):
        states = [np.array(env.unwrapped.state) for env in self.envs.envs]
        clocks = [env.get_wrapper_attr("_elapsed_steps") for env in self.envs.envs]
        generators = [env.unwrapped.np_random.bit_generator.state for env in self.envs.envs]
        return {
            "states": np.array(states),
            "clocks": np.array(clocks),
            "totals": self.totals.copy(),
            "generators": generators,
        }

    def restore(self, state):
        self.envs.reset()
        for i, env in enumerate(self.envs.envs):
            env.unwrapped.state = state["states"][i].copy()
            env.set_wrapper_attr("_elapsed_steps", int(state["clocks"][i]))
            env.unwrapped.np_random.bit_generator.state = state["generators"][i]
        self.totals = state["totals"].copy()
