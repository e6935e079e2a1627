"""From files to answers: feeds frames to the pipeline, one after another, and measures it."""
