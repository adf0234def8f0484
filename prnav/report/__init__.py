"""Reports: tables, curves, maps with trajectories, drawings of designs, one static page. Needs no torch."""
