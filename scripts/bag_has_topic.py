#!/usr/bin/env python3
"""Ends with 0 if a bag has messages of a topic, with 1 if not: bag_has_topic.py FILE TOPIC."""

import sys

import rosbag


def main():
    with rosbag.Bag(sys.argv[1]) as bag:
        return 0 if bag.get_message_count([sys.argv[2]]) > 0 else 1


if __name__ == '__main__':
    sys.exit(main())
