"""At which sample rates do printed and shipped gains work, and under which discretisation?"""
