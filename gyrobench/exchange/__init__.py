"""Files of other tools: SSP archives, container FMUs, result files."""
