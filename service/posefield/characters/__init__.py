"""Characters of users: rigs in USD or glTF files to which motions are delivered."""
