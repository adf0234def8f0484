"""Finding sensor designs: the joint method, searches, a cheap proxy, and specialists that designs are judged by.

:mod:`.gaussian` is the design policy, :mod:`.joint` trains it beside the control policy; :mod:`.search` holds the
baselines, :mod:`.proxy` the score that needs no training, :mod:`.specialist` what a design is worth; :mod:`.optimize`
runs a search from start to end and :mod:`.sweep` many specialists side by side.
"""
