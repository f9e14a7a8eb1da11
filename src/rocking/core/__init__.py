"""What every other part uses: checks, numbers with units, results, tables and files, progress, threads."""
