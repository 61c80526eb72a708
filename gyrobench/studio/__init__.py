"""The bench in the browser: pages that show what is there, and start what the workflow does.  Nothing is computed."""
