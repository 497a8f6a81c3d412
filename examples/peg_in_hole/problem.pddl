; SPDX-FileCopyrightText: The slap_ros authors
; SPDX-License-Identifier: Apache-2.0
(define (problem both_pegs)
  (:domain peg_in_hole)
  (:objects peg1 peg2 - peg hole1 hole2 - hole)
  (:init (HandEmpty) (OnTable peg1) (OnTable peg2) (IsClear hole1) (IsClear hole2))
  (:goal (and (In peg1 hole1) (In peg2 hole2))))
