"""Historians: OPC UA servers and the PI Web API, found tag by tag and read in blocks of loops. Nothing is written."""
