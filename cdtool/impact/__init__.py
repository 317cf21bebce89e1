"""What happens in an impact: contact laws, restitution, transmissions, and which sensor sees it first."""
