#!/usr/bin/env python3
"""Types to running nodes what the documents tell a user to type: scripts/type_commands as a test."""

import os
import subprocess
import unittest

import rospkg
import rostest


class TypedCommands(unittest.TestCase):
    def test_all_work(self):
        script = os.path.join(rospkg.RosPack().get_path('pf_resampling'), 'scripts', 'type_commands')
        done = subprocess.run([script], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True,
                              timeout=360)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn(', 0 did not', done.stdout)


if __name__ == '__main__':
    rostest.rosrun('pf_resampling', 'typed_commands', TypedCommands)
