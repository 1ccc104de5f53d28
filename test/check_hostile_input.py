#!/usr/bin/env python3
"""Attacks both nodes over their topics and services while a robot drives on a circle: neither may end, and within 30 s of
good input after each attack the pose is good again. Prints each node's error and memory before, at worst, and after."""

import sys
import unittest

import rospy
import rostest
from hostile_messages import (NODES, begin_drive, clock_from_1970, false_landmarks, false_lengths, far_clock, far_odometry,
                              forget_peak, large_scan, late_particles, late_pose, long_names, many_beacons, memory_of,
                              no_map, other_beacons, peak_of, process_of)

# m. What is driven and seen is exact: a filter that is right is within 0.4 m, with a map that it made itself.
LOST = 1.0
MOST_MEMORY = 1000  # MiB, of nodes that take 20, and with sanitizers 300: what only says that it comes takes more
ATTACKS = (other_beacons, many_beacons, late_pose, late_particles, long_names, far_clock, far_odometry, large_scan, no_map,
           false_lengths, false_landmarks, clock_from_1970)


class HostileInput(unittest.TestCase):
    def test_no_attack_ends_a_node(self):
        drive = begin_drive()
        self.processes = {name: process_of(name) for name in NODES}
        before = self.expect_good(drive, 'nothing yet')
        print('{:16} {:11} {:>8} {:>8} {:>8}   {:>5} {:>5} {:>5} MiB'.format(
            'attack', 'node', 'before', 'worst', 'after m', 'before', 'most', 'after'), flush=True)
        for attack in ATTACKS:
            for name in NODES:
                drive.heard[name].clear()
                forget_peak(self.processes[name])
            attack(drive)
            drive.go_on(30.0)
            after = self.expect_good(drive, attack.__name__)
            for name in NODES:
                worst = max(error for _, error in drive.heard[name])
                most = peak_of(self.processes[name])
                print('{:16} {:11} {:8.3f} {:8.3f} {:8.3f}   {:5} {:5} {:5}'.format(
                    attack.__name__, name, before[name][0], worst, after[name][0], before[name][1], most,
                    after[name][1]), flush=True)
                self.assertLess(most, MOST_MEMORY, '{} after {}'.format(name, attack.__name__))
            before = after

    def expect_good(self, drive, what):
        """The error (m) and the memory (MiB) of each node."""
        present = {name: (drive.error(name), memory_of(self.processes[name])) for name in NODES}
        for name in NODES:
            self.assertLess(present[name][0], LOST, '{} after {}'.format(name, what))
        return present


if __name__ == '__main__':
    rospy.init_node('check_hostile_input')
    rostest.rosrun('pf_resampling', 'hostile_input', HostileInput, sys.argv)
