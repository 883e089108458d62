"""The benchmark: cells, episodes, their store, and the tables and figures made from them."""
