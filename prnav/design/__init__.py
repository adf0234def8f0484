"""Design of the sensors themselves: a policy over designs, joint optimisation with the control policy, baselines."""
