"""What the project is measured by: solves of today held against those of an earlier commit."""
