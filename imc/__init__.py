"""The IMC protocol: messages, codec, schema, logs."""
