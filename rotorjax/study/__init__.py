"""The paper's evaluation: cases, run, figures, report."""
