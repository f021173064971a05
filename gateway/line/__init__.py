"""One line: who is asked what and when. Pure but for `port` and `master`."""
