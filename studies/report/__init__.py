"""`antenna-ocp report`: a results folder as one page that opens offline, its motion and figures."""
