"""What the user asks for: accuracy goals and quantities as they are typed."""
