"""What a command does, as plain functions: info, learn_signature, detect, benchmark. They print nothing."""
