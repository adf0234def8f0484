"""``python -m prnav.train`` is ``prnav-train``: what launchers such as torchrun want to be given."""

import runpy

if __name__ == "__main__":
    # by name, since this package may not import the commands
    runpy.run_module("prnav.cli.train", run_name="__main__", alter_sys=True)
