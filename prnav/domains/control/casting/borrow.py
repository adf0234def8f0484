"""Arrays without reference counts, for compiled loops.

Counting references is atomic and takes longer than most of what a ray needs. The loops' caller holds all arrays for as
long as they run, so they need no counts of their own.
"""

from __future__ import annotations

from llvmlite import ir
from numba.extending import intrinsic

from prnav.aliases import Untyped


def _borrowed(typing, array):

    def generate(context, builder, signature, values):
        view = context.make_array(signature.args[0])(context, builder, values[0])
        view.meminfo = ir.Constant(view.meminfo.type, None)
        view.parent = ir.Constant(view.parent.type, None)
        return view._getvalue()

    return array(array), generate


borrowed: Untyped = intrinsic(_borrowed)
"""``borrowed(array)`` is the same array, uncounted: valid only while its owner holds it."""
