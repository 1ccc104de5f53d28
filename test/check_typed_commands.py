#!/usr/bin/env python3
"""Types to running nodes what the documents tell a user to type: scripts/type_commands as a test."""

import os
import subprocess
import tempfile
import unittest

import rospkg
import rostest


class TypedCommands(unittest.TestCase):
    def test_all_work(self):
        script = os.path.join(rospkg.RosPack().get_path('pf_resampling'), 'scripts', 'type_commands')
        with tempfile.TemporaryFile('w+') as output:
            process = subprocess.Popen([script], stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT)
            try:
                status = process.wait(timeout=540)
            except subprocess.TimeoutExpired:
                process.terminate()  # it ends its nodes
                status = process.wait()
            output.seek(0)
            self.assertEqual(status, 0, output.read())


if __name__ == '__main__':
    rostest.rosrun('pf_resampling', 'typed_commands', TypedCommands)
