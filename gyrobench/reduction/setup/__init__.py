"""What was stated of a test and its record: site, set-up, plan, errors of the set-up."""
