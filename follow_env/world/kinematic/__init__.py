"""The compiled world of many episodes: places, robots and routes in records."""
