"""Evaluation: an explicit list of episodes, any agent, records that do not depend on how they were made.

The modules, in the order data takes: :mod:`prnav.evaluate.slots` is what is asked of an environment,
:mod:`prnav.evaluate.agents` and :mod:`prnav.evaluate.learned` act, :mod:`prnav.evaluate.evaluator` runs them,
:mod:`prnav.evaluate.records` keeps what happened, :mod:`prnav.evaluate.intervals` and :mod:`prnav.evaluate.summary`
say what it means. Only ``learned`` imports torch, so the report can read records without it.
"""
