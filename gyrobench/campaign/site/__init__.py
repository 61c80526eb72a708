"""Pages and figures of a campaign's analysis."""
