"""What many tests are made from: machines, motions, logs, results of builds. No tests."""
