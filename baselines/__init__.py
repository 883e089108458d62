"""Who drives: policies, controllers, learned agents, the benchmark and the command line."""
