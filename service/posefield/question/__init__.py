"""Types of queries, the same for HTTP, commands and tables.

Each parameter is declared once, as a field of a type. The URL parameter, the key of a JSON body,
the column of a table and the option of a command, with unit and help, follow from the field.
"""
