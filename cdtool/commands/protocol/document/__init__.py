"""The test protocol as a document: one model of its blocks, written as HTML and as PDF, in two languages."""
