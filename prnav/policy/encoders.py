"""From one step's observation to one vector: the paper's transformer, a compact MLP, and a blind encoder.

Encoders of pictures are in :mod:`prnav.policy.camera_encoders`, which build on what is here.

Letters in shapes: B batch, K sensors, P photoreceptors per sensor (grid * grid), D encoder width, S tokens.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

from prnav.contracts import ObservationSpecs
from prnav.errors import ConfigError
from prnav.policy.actions.head import orthogonal
from prnav.policy.block_cpu import block as block_on_cpu
from prnav.policy.config import PolicyConfig
from prnav.policy.features import vector_features
from prnav.policy.observed import Observations, batch_size, seen_with_design, vector_keys
from prnav.policy.readout_cpu import attended_readout
from prnav.policy.tokens_cpu import Tokens

GOAL = "pointgoal"


def scale_readings(readings: Tensor) -> Tensor:
    """Readings in [0, 1] centred and spread to about unit variance."""
    return 4.0 * readings - 2.0


def _receptors(specs: ObservationSpecs, encoder: str) -> tuple[str, str, tuple[int, int, int]]:
    """Names of readings and design; K, P and the length of one design vector."""
    readings, design = seen_with_design(specs, "receptors", encoder, "use encoder 'blind' for an agent that sees none")
    shape, of_design = specs[readings].shape, specs[design].shape
    if len(shape) != 3 or shape[2] != 3 or len(of_design) != 2 or of_design[0] != shape[0]:
        raise ConfigError(
            f"policy encoder {encoder!r} needs {readings} (K, P, 3) and {design} (K, 7); it got {shape} and {of_design}"
        )
    return readings, design, (shape[0], shape[1], of_design[1])


class BlindEncoder(nn.Module):
    """MLP over the vector observations alone: GPS, compass and, where the task gives one, the goal.

    Where there are none, its input is a learned constant: the policy can then do no better than one sequence of
    actions, by its memory and by what it did before (the paper's blind agent in the DeepMind Control Suite).
    """

    def __init__(self, config: PolicyConfig, specs: ObservationSpecs) -> None:
        super().__init__()
        self.keys = vector_keys(specs)
        inputs = sum(vector_features(key, specs[key].shape[0])[1] for key in self.keys) or config.width
        self.layers = nn.Sequential(
            orthogonal(nn.Linear(inputs, config.width)),
            nn.ReLU(),
            orthogonal(nn.Linear(config.width, config.width)),
            nn.ReLU(),
        )
        self.constant = None if self.keys else nn.Parameter(torch.randn(config.width))

    def vectors(self, observations: Observations) -> Tensor:
        """Features of all vector observations, (B, inputs)."""
        if self.constant is not None:
            return self.constant.expand(batch_size(observations), -1)
        return torch.cat([vector_features(key, 0)[0](observations[key]) for key in self.keys], dim=-1)

    def forward(self, observations: Observations) -> Tensor:
        """Encoding (B, D)."""
        encoding: Tensor = self.layers(self.vectors(observations))
        return encoding


class StateEncoder(BlindEncoder):
    """The same MLP for agents that are given the simulator's state: an upper bound of what sensors can be worth."""

    def __init__(self, config: PolicyConfig, specs: ObservationSpecs) -> None:
        if not vector_keys(specs):
            raise ConfigError(
                f"policy encoder 'state' needs a vector observation; the environment gives "
                f"{', '.join(sorted(specs)) or 'nothing'}; let it give its state, or use another encoder"
            )
        super().__init__(config, specs)


class CompactEncoder(nn.Module):
    """MLP over all readings, all designs and the vector observations at once: about 100 times cheaper than tokens."""

    def __init__(self, config: PolicyConfig, specs: ObservationSpecs) -> None:
        super().__init__()
        self.readings, self.design, (sensors, receptors, design) = _receptors(specs, config.encoder)
        self.keys = vector_keys(specs)
        vectors = sum(vector_features(key, specs[key].shape[0])[1] for key in self.keys)
        self.layers = nn.Sequential(
            orthogonal(nn.Linear(sensors * receptors * 3 + sensors * design + vectors, config.width)),
            nn.ReLU(),
            orthogonal(nn.Linear(config.width, config.width)),
            nn.ReLU(),
        )

    def forward(self, observations: Observations) -> Tensor:
        """Encoding (B, D)."""
        parts = [scale_readings(observations[self.readings]).flatten(1), observations[self.design].flatten(1)]
        parts += [vector_features(key, 0)[0](observations[key]) for key in self.keys]
        encoding: Tensor = self.layers(torch.cat(parts, dim=-1))
        return encoding


def _fast(tokens: Tensor) -> bool:
    """Whether compiled loops take the place of torch's: on a CPU in float32."""
    plain = torch.compiler.is_compiling() or torch.is_autocast_enabled("cpu")
    return tokens.device.type == "cpu" and tokens.dtype == torch.float32 and not plain


class TransformerBlock(nn.Module):
    """Attention and MLP, each normalised before and added to the tokens."""

    def __init__(self, width: int, heads: int, feedforward: int) -> None:
        super().__init__()
        self.heads = heads
        self.attention_norm = nn.LayerNorm(width)
        self.attention_in = nn.Linear(width, 3 * width)
        self.attention_out = nn.Linear(width, width)
        self.mlp_norm = nn.LayerNorm(width)
        self.mlp_in = nn.Linear(width, feedforward)
        self.mlp_out = nn.Linear(feedforward, width)

    def forward(self, tokens: Tensor) -> Tensor:
        """Tokens (B, S, D) after one layer."""
        batch, count, width = tokens.shape
        if _fast(tokens) and width // self.heads % 2 == 0 and count > 1:
            return block_on_cpu(tokens, self.heads, list(self.parameters()))
        split = self.attention_in(self.attention_norm(tokens)).view(batch, count, 3, self.heads, width // self.heads)
        query, key, value = split.permute(2, 0, 3, 1, 4).unbind(0)
        attended = functional.scaled_dot_product_attention(query, key, value)
        return self._finish(tokens, attended.transpose(1, 2).reshape(batch, count, width))

    def first(self, tokens: Tensor) -> Tensor:
        """The first token (B, D) after one layer: what :meth:`forward` gives at a tenth of the cost.

        With one query per head, keys and values need not be made: the query is carried through the keys' weights to
        the tokens, and the tokens' weighted mean through the values'. The keys' bias adds the same to all scores.
        """
        batch, _, width = tokens.shape
        if _fast(tokens):
            norm, maps = self.attention_norm, self.attention_in
            attended, first = attended_readout(tokens, self.heads, norm.weight, norm.bias, maps.weight, maps.bias)
            return self._finish(first, attended)
        normed = self.attention_norm(tokens)
        of_query, of_key, of_value = self.attention_in.weight.view(3, self.heads, width // self.heads, width)
        to_query, _, to_value = self.attention_in.bias.view(3, width)
        query = functional.linear(normed[:, 0], of_query.reshape(width, width), to_query).view(batch, self.heads, -1)
        probe = torch.einsum("bhe,hed->bhd", query, of_key) * query.shape[-1] ** -0.5
        weights = torch.softmax(probe @ normed.transpose(1, 2), dim=-1)  # (B, heads, S)
        attended = torch.einsum("bhd,hed->bhe", weights.to(normed.dtype) @ normed, of_value).reshape(batch, width)
        return self._finish(tokens[:, 0], attended + to_value)

    def _finish(self, tokens: Tensor, attended: Tensor) -> Tensor:
        """Tokens (..., D) after the rest of the layer."""
        tokens = tokens + self.attention_out(attended)
        changed: Tensor = self.mlp_out(functional.gelu(self.mlp_in(self.mlp_norm(tokens))))
        return tokens + changed


class TokenTransformer(nn.Module):
    """Tokens of what is seen, after a readout token and tokens of the vectors; the encoding is the readout's output.

    The goal, where the task has one, makes a token, all other vectors, such as GPS and compass, another. What the last
    layer makes of all other tokens than the readout is never asked for, and not computed.
    """

    def __init__(self, config: PolicyConfig, specs: ObservationSpecs) -> None:
        super().__init__()
        width = self.width = config.width
        self.make_sight(config, specs)
        self.readout = nn.Parameter(0.02 * torch.randn(width))
        keys = vector_keys(specs)
        self.groups = [[key for key in keys if key != GOAL], [key for key in keys if key == GOAL]]
        self.groups = [group for group in self.groups if group]
        self.vector_tokens = nn.ModuleList(
            nn.Linear(sum(vector_features(key, specs[key].shape[0])[1] for key in group), width)
            for group in self.groups
        )
        self.blocks = nn.ModuleList(
            TransformerBlock(width, config.transformer_heads, config.feedforward)
            for _ in range(config.transformer_layers)
        )
        self.norm = nn.LayerNorm(width)

    def make_sight(self, config: PolicyConfig, specs: ObservationSpecs) -> None:
        """Make the layers of :meth:`sight_tokens`."""
        raise NotImplementedError

    def sight_tokens(self, observations: Observations) -> Tensor:
        """Tokens (B, S', D) of what is seen."""
        raise NotImplementedError

    def vectors(self, observations: Observations) -> Tensor:
        """Tokens (B, V, D) of the vectors, of which there may be none."""
        if not self.groups:
            return self.readout.new_zeros(batch_size(observations), 0, self.width)
        return torch.stack(
            [
                layer(torch.cat([vector_features(key, 0)[0](observations[key]) for key in group], dim=-1))
                for layer, group in zip(self.vector_tokens, self.groups, strict=True)
            ],
            dim=1,
        )

    def tokens(self, observations: Observations) -> Tensor:
        """Input tokens (B, S, D): readout, vectors, then what is seen."""
        sight = self.sight_tokens(observations)
        readout = self.readout.to(sight.dtype).expand(len(sight), 1, -1)
        vectors = [self.vectors(observations)] if self.groups else []
        return torch.cat([readout, *vectors, sight], dim=1)

    def forward(self, observations: Observations) -> Tensor:
        """Encoding (B, D)."""
        tokens = self.tokens(observations)
        for block in self.blocks[:-1]:
            tokens = block(tokens)
        last = self.blocks[-1]
        assert isinstance(last, TransformerBlock)
        encoding: Tensor = self.norm(last.first(tokens))
        return encoding


def token_parts(layer: nn.Linear, designs: Tensor, positions: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """One linear map of [what is seen, design, place] in three parts, so that each is mapped as often as it differs.

    Args:
        layer: The map, from as many numbers as the three have together.
        designs: Of the sensors, (B, K, E).
        positions: Embeddings of the places in a sensor, (P, Q).

    Returns:
        The weight (D, ...) of what is seen; what designs (B, K, D) and places (P, D) add.
    """
    design, place = designs.shape[-1], positions.shape[1]
    of_seen, of_design, of_place = torch.split(layer.weight, [layer.in_features - design - place, design, place], dim=1)
    return of_seen, functional.linear(designs, of_design, layer.bias), functional.linear(positions, of_place)


class TransformerEncoder(TokenTransformer):
    """The paper's encoder of photoreceptors (section "Architecture" and its figure in the appendix).

    One token per photoreceptor: [reading, design of its sensor, learned embedding of its place in the grid].
    """

    def make_sight(self, config: PolicyConfig, specs: ObservationSpecs) -> None:
        """Places in the grid, and the map to tokens."""
        self.readings, self.design, (_, receptors, design) = _receptors(specs, config.encoder)
        self.positions = nn.Parameter(0.02 * torch.randn(receptors, config.position_width))
        self.receptor_token = nn.Linear(3 + design + config.position_width, config.width)

    def sight_tokens(self, observations: Observations) -> Tensor:
        """Tokens (B, K * P, D) of the photoreceptors of each sensor in turn."""
        readings, of_reading, designs, places = self._parts(observations)
        tokens = functional.linear(readings, of_reading) + designs[:, :, None]
        return (tokens + places).flatten(1, 2)

    def tokens(self, observations: Observations) -> Tensor:
        """Input tokens (B, S, D): readout, vectors, then what is seen."""
        if not _fast(observations[self.readings]) or observations[self.design].dtype != torch.float32:
            return super().tokens(observations)
        readings, of_reading, designs, places = self._parts(observations)
        vectors = self.vectors(observations)
        tokens: Tensor = Tokens.apply(self.readout, vectors, readings, of_reading.t(), designs, places)  # type: ignore[no-untyped-call]
        return tokens

    def _parts(self, observations: Observations) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Readings (B, K, P, 3), and the three parts of their map to tokens as :func:`token_parts` has them."""
        parts = token_parts(self.receptor_token, observations[self.design], self.positions)
        return scale_readings(observations[self.readings]), *parts
