"""`jackbench open [RUN]`."""
