"""What a report shows of each kind of study: `charts(result)` and `scene(result)` of a subject."""
