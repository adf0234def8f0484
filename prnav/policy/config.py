"""What a policy is made of, as pure data."""

from __future__ import annotations

from dataclasses import dataclass

from prnav.checks import require_at_least
from prnav.registry import require_known

ENCODERS: dict[str, str] = {
    "transformer": "prnav.policy.encoders:TransformerEncoder",
    "compact": "prnav.policy.encoders:CompactEncoder",
    "blind": "prnav.policy.encoders:BlindEncoder",
    "state": "prnav.policy.encoders:StateEncoder",
    "camera": "prnav.policy.camera_encoders:CameraEncoder",
    "resnet50": "prnav.policy.camera_encoders:ResNetEncoder",
}
"""Module and class of each encoder, by the name that a config gives it: a subclass of ``torch.nn.Module`` that is made
from (config, observation specs) and maps observations (B, ...) by name to encodings (B, width)."""

MEMORIES: dict[str, str] = {
    "lstm": "prnav.policy.memory.lstm:LSTMMemory",
    "stack": "prnav.policy.memory.stack:StackMemory",
    "none": "prnav.policy.memory.none:NoMemory",
}
"""Module and class of each memory, by the name that a config gives it: a :class:`prnav.policy.memory.Memory` that is
made from (number of features, config, whether GPS and compass are given to it)."""


@dataclass(frozen=True)
class PolicyConfig:
    """Encoder, memory and heads of a policy.

    The paper gives the shape (three transformer layers, a 2-layer LSTM, actor and critic) and no widths; the widths
    here are those of DD-PPO's agents, rounded to what a GPU likes. On a CPU take the compact encoder and a smaller
    core, as ``configs/quickstart.toml`` does.
    """

    encoder: str = "transformer"
    """"transformer": the paper's, one token per photoreceptor; "compact": one MLP over all readings and designs, for
    CPUs; "blind": the vectors alone, and a learned constant where there are none (the paper's intelligent blind agent);
    "state": the vectors alone, which must be there (an upper bound, where they are the simulator's state); "camera":
    the same transformer over a camera's patches of 16 x 16 pixels; "resnet50": torchvision's, with group norm. The last
    two need pictures, such as ``env.camera_size`` gives."""
    width: int = 128
    """Width of the encoder's output, of the transformer's tokens and of the MLP's hidden layer."""
    transformer_layers: int = 3
    transformer_heads: int = 4
    feedforward: int = 256
    """Hidden units of the MLP in each transformer layer."""
    position_width: int = 16
    """Width of the learned embedding of a photoreceptor's place in its grid."""
    memory: str = "lstm"
    """"lstm": the paper's in navigation; "stack": the encodings of the last ``frames`` steps side by side, the paper's
    in the DeepMind Control Suite; "none": the encoding of the step alone."""
    frames: int = 3
    """Steps that the stack holds, this one included."""
    lstm_hidden: int = 512
    lstm_layers: int = 2
    skip: bool = False
    """Whether actor and critic also see what the LSTM is given: short runs learn sooner what needs no
    memory. The paper's agents have no such path. With another memory they always see it."""
    head_hidden: int = 0
    """Hidden units of the actor's and the critic's MLP; 0 makes them linear."""
    previous_action: bool = True
    """Whether the last action is an input of the memory (as in DD-PPO's agents): embedded where it is one of a few, as
    it is where it is a vector."""
    displacement: bool = False
    """Whether the way moved since the last step, by GPS and compass, is an input of the LSTM. It can
    learn this difference, but not soon: with it, an agent of few steps notices that it is stuck."""

    def __post_init__(self) -> None:
        require_known(self.encoder, ENCODERS, "encoder")
        require_known(self.memory, MEMORIES, "memory")
        require_at_least(self, 1, "width", "transformer_layers", "transformer_heads", "feedforward", "position_width")
        require_at_least(self, 1, "lstm_hidden", "lstm_layers", "frames")
        if self.displacement and self.memory != "lstm":
            raise ValueError(f"displacement is an input of the LSTM, and memory is {self.memory!r}; leave it out")
        if self.head_hidden < 0:
            raise ValueError(f"head_hidden is {self.head_hidden}; it must be 0 (linear heads) or more")
        if self.encoder in ("transformer", "camera") and self.width % self.transformer_heads:
            raise ValueError(
                f"width {self.width} cannot be split over {self.transformer_heads} transformer_heads; "
                f"make it a multiple of {self.transformer_heads}"
            )
