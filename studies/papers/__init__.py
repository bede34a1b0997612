"""The experiments of the papers, rows of physics.md section 5, each group as one study."""
