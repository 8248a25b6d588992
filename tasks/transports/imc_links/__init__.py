"""What tasks that carry IMC packets over a network share: message lists, peers, sockets."""
