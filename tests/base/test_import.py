import subprocess
import sys


def test_importing_the_package_pulls_in_nothing_heavy():
    heavy = "('torch', 'numba', 'OpenGL', 'pyrender', 'matplotlib', 'embreex', 'trimesh')"
    code = f"import prnav, sys; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_public_name_is_there():
    import prnav

    for name in prnav.__all__:
        assert getattr(prnav, name) is not None
