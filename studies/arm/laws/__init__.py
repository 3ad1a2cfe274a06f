"""Rest-to-rest laws of a unit turn: shapes, rigid torques along them, what they leave."""
