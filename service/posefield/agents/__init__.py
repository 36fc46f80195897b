"""Server for agents: tools to look at models and to plan and write performances, over MCP."""
