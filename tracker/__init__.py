"""Who sees: from an RGB-D picture to a person, a (bearing, distance) measurement and an estimate of it.

Works on any RGB-D stream, simulated or recorded; knows neither the simulator nor who drives.
"""
