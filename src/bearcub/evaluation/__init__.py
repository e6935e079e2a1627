"""Truth against answers: simulated and recorded scenes, and the table of what was reached."""
