"""Parameters from recordings: windows with free start states, priors, confidence."""
