"""Shows: what is too long for a test. Seeded cases, each in a process of its own, resumable."""
