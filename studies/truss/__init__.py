"""The ring truss: its optimal deployment, stated, solved, verified, drawn and exported."""
