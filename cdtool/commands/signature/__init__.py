"""Does a signature still fit: were there enough runs, does the machine drift away from it, should it be relearned?"""
