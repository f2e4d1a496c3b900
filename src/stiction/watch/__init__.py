"""Watch a plant: collect from live sources, judge each window with an audit, raise and clear alarms."""
