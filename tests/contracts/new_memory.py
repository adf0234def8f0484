"""A memory in one module: what the rows hold, doubled, and nothing from before."""

from prnav.policy.memory import NoMemory


class DoublingMemory(NoMemory):
    """Twice the features."""

    def step(self, inputs, state, starts):
        return 2.0 * inputs.features, {}

    def sequence(self, inputs, state, starts, plan):
        return 2.0 * inputs.features
