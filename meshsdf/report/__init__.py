"""What was lost?"""
