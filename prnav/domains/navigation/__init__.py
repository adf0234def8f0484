"""Navigation in textured homes: tasks, environments, oracle, rule agents, maps, pictures and state probe."""
