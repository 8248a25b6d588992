"""Common parts of tasks that carry IMC packets over a network: message lists, peers, sockets."""
