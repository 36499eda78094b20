"""`jackbench trace-study`: traces campaigns whose truth is known, and scores the answers."""
