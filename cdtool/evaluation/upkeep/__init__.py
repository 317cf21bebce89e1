"""Does a signature still fit: were there enough runs, does the machine drift away from it, is it to be learned anew?"""
