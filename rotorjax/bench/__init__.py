"""What every application uses: cases and settings, solving and keeping one case, schedule, tables and pictures."""
