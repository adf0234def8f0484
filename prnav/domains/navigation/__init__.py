"""Navigation in textured homes: PointGoalNav and TargetNav, their environments, oracle, agents, maps and probe."""
