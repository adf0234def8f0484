"""What a policy is made of, as pure data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

EncoderName = Literal["transformer", "compact", "blind", "camera", "resnet50"]


@dataclass(frozen=True)
class PolicyConfig:
    """Encoder, recurrent core and heads of a policy.

    The paper gives the shape (three transformer layers, a 2-layer LSTM, actor and critic) and no widths; the widths
    here are those of DD-PPO's agents, rounded to what a GPU likes. On a CPU take the compact encoder and a smaller
    core, as ``configs/quickstart.toml`` does.
    """

    encoder: EncoderName = "transformer"
    """"transformer": the paper's, one token per photoreceptor; "compact": one MLP over all readings and designs, for
    CPUs; "blind": no readings at all (the paper's intelligent blind agent); "camera": the same transformer over a
    camera's patches of 16 x 16 pixels; "resnet50": torchvision's, with group norm. The last two need
    ``env.camera_size``."""
    width: int = 128
    """Width of the encoder's output, of the transformer's tokens and of the MLP's hidden layer."""
    transformer_layers: int = 3
    transformer_heads: int = 4
    feedforward: int = 256
    """Hidden units of the MLP in each transformer layer."""
    position_width: int = 16
    """Width of the learned embedding of a photoreceptor's place in its grid."""
    lstm_hidden: int = 512
    lstm_layers: int = 2
    skip: bool = False
    """Whether actor and critic also see what the LSTM is given: short runs learn sooner what needs no
    memory. The paper's agents have no such path."""
    head_hidden: int = 0
    """Hidden units of the actor's and the critic's MLP; 0 makes them linear."""
    previous_action: bool = True
    """Whether the last action, embedded, is an input of the recurrent core (as in DD-PPO's agents)."""
    displacement: bool = False
    """Whether the way moved since the last step, by GPS and compass, is an input of the recurrent core. An LSTM can
    learn this difference, but not soon: with it, an agent of few steps notices that it is stuck."""

    def __post_init__(self) -> None:
        for name in ("width", "transformer_layers", "transformer_heads", "feedforward", "position_width"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} is {getattr(self, name)}; it must be at least 1")
        for name in ("lstm_hidden", "lstm_layers"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} is {getattr(self, name)}; it must be at least 1")
        if self.displacement and self.lstm_hidden < 3:
            raise ValueError(f"lstm_hidden is {self.lstm_hidden}; with displacement it must be at least 3")
        if self.head_hidden < 0:
            raise ValueError(f"head_hidden is {self.head_hidden}; it must be 0 (linear heads) or more")
        if self.encoder in ("transformer", "camera") and self.width % self.transformer_heads:
            raise ValueError(
                f"width {self.width} cannot be split over {self.transformer_heads} transformer_heads; "
                f"make it a multiple of {self.transformer_heads}"
            )
