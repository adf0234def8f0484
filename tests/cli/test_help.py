"""--help of every command and of every command within one."""

import argparse
import importlib

import pytest

COMMANDS = (
    "prnav",
    "prnav-train",
    "prnav-eval",
    "prnav-episodes",
    "prnav-scenes",
    "prnav-design",
    "prnav-bench",
    "prnav-report",
)


def _parsers(parser: argparse.ArgumentParser):
    yield parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for inner in action.choices.values():
                yield from _parsers(inner)


def _all():
    for command in COMMANDS:
        module = importlib.import_module(f"prnav.cli.{command.removeprefix('prnav-')}")
        yield from _parsers(module.parser())


@pytest.mark.parametrize("parser", [pytest.param(parser, id=parser.prog.replace(" ", "-")) for parser in _all()])
def test_help_reads_as_it_was_written(parser):
    text = parser.format_help()
    assert "%%" not in text and "%(" not in text
    assert "None" not in text and "\x1b" not in text
    assert all(action.help for action in parser._actions if action.option_strings), "an option lacks its help"
